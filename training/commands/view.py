"""The view command: a page that shows many worlds side by side, in a browser."""

from typing import Any

from rigid_envs.vector_env import RigidVectorEnv
from rigid_envs.viewer.server import AddressUnavailable, ViewServer, check_address
from rigid_envs.viewer.session import Session
from training.policies.policy import Policy
from training.settings.environments import make_vector_env
from training.settings.errors import UsageError


def view(
    env_id: str,
    policy: Policy | None = None,
    *,
    num_worlds: int = 16,
    seed: int = 0,
    host: str = "127.0.0.1",
    port: int = 8080,
    **env_kwargs: Any,
) -> None:
    """Serves the page until Ctrl-C.

    Args:
        env_id: Environment id.
        policy: Chooses the actions; random ones if None.
        num_worlds: Number of worlds.
        seed: Seed of the first world; the others count up.
        host: Address to listen on. 127.0.0.1 accepts connections from this machine only.
        port: Port to listen on; 0 chooses a free one.
        env_kwargs: Arguments of the environment that replace those of the policy's training.

    Raises:
        UsageError: The id or an argument is invalid, the policy is for another environment, or the
            port is in use.
    """
    server = serve(
        env_id, policy, num_worlds=num_worlds, seed=seed, host=host, port=port, **env_kwargs
    )
    print(f"{env_id}, {num_worlds} worlds: open {server.url} in a browser; Ctrl-C ends")
    try:
        server.run()
    except KeyboardInterrupt:
        print("ended")
    finally:
        server.close()


def serve(
    env_id: str,
    policy: Policy | None = None,
    *,
    num_worlds: int,
    seed: int,
    host: str,
    port: int,
    **env_kwargs: Any,
) -> ViewServer:
    """The server of the page, which already listens; for arguments and errors see `view`."""
    arguments = {**(policy.env_kwargs if policy else {}), **env_kwargs}
    try:
        check_address(host, port)  # at once, not after kernels have been compiled
        envs = make_vector_env(env_id, num_worlds, **arguments).unwrapped
        if not isinstance(envs, RigidVectorEnv):
            raise UsageError(f"{env_id} cannot be viewed: it isn't an environment of rigid-envs")
        if policy:
            policy.check(envs.single_observation_space)
        session = Session(envs.runner, policy.act if policy else None, seed)
        return ViewServer(session, host, port, env_id, seed)
    except AddressUnavailable as error:
        raise UsageError(f"{error}; choose another one with --port or --host") from error
