"""Kernels on disk, when several processes save them at once."""

from numba.core.caching import IndexDataCacheFile

from physics.compiler.code_cache import EntryFiles
from physics.compiler.jit import entry


def saved_at_once(files, folder):
    """Two processes read the same index before either of them writes; what each then finds."""
    one, other = (files(str(folder), "kernel", "stamp") for _ in range(2))
    one.flush()
    before = one._load_index()
    one.save("of a", "code of a")
    other._load_index = before.copy
    other.save("of b", "code of b")
    return [files(str(folder), "kernel", "stamp").load(key) for key in ("of a", "of b")]


def test_no_kernel_takes_the_place_of_another(tmp_path):
    found = saved_at_once(EntryFiles, tmp_path)
    assert found[0] in ("code of a", None)  # lost from the index: it is compiled again
    assert found[1] == "code of b"


def test_an_index_that_lost_a_kernel_never_gives_another(tmp_path):
    """The order in which numba mixes them up: index of b, then the code of a."""
    for files, expected in ((IndexDataCacheFile, "code of a"), (EntryFiles, "code of b")):
        one, other = (files(str(tmp_path), files.__name__, "stamp") for _ in range(2))
        one.flush()
        write = one._save_data
        waiting = []
        one._save_data = lambda name, data, waiting=waiting: waiting.append((name, data))
        one.save("of a", "code of a")
        other._load_index = dict
        other.save("of b", "code of b")
        write(*waiting[0])
        assert files(str(tmp_path), files.__name__, "stamp").load("of b") == expected


def test_entries_keep_their_kernels_in_these_files():
    @entry
    def twice(x):
        return 2.0 * x

    assert isinstance(twice.compiled._cache._cache_file, EntryFiles)
