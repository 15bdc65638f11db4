"""Ray clusters of two nodes on this machine."""

import contextlib
import os

import pytest

os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
os.environ.setdefault("RAY_AUTH_MODE", "disabled")


@contextlib.contextmanager
def started():
    """A cluster of two nodes with one CPU each; the driver's node is the first."""
    pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    node = {"num_cpus": 1, "object_store_memory": 100 * 2**20}
    cluster = Cluster(initialize_head=True, head_node_args={**node, "include_dashboard": False})
    try:
        cluster.add_node(**node)
        cluster.wait_for_nodes()
        yield cluster
    finally:
        cluster.shutdown()


@pytest.fixture
def fragile():
    """A cluster of its own for a test that kills a node."""
    with started() as cluster:
        yield cluster


@pytest.fixture(scope="session")
def address():
    """The address of a cluster that tests share."""
    with started() as cluster:
        yield cluster.address


@pytest.fixture
def joined(address):
    """Connects the test to the shared cluster."""
    from training.cluster.connection import connected

    with connected(address):
        yield
