"""Compiled programs on disk: what the next process takes from there, and what may be wrong with the folder."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import jax
import pytest

from twin import compile_cache
from twin._checks import InputError
from twin.compile_cache import use_compile_cache

ROOT = Path(__file__).parents[2]
SETTINGS = ("jax_compilation_cache_dir", "jax_persistent_cache_min_compile_time_secs", "jax_enable_compilation_cache")
SECONDS = "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"
PROGRAM = """
import json, sys
from collections import Counter
import jax, jax.numpy as jnp
from twin.compile_cache import use_compile_cache
events = Counter()
jax.monitoring.register_event_listener(lambda event, **_: events.update([event.rpartition("/")[2]]))
start = jnp.linspace(0.1, 1.0, 7) + 1.0  # also after a first program
folder = use_compile_cache(sys.argv[1])
value = jax.jit(lambda x: jax.lax.scan(lambda c, _: (jnp.cos(c @ c) * c, c.sum()), x, None, length=5)[1].sum())(start)
print(json.dumps([folder, events["cache_hits"], events["cache_misses"], float(value)]))
"""


def started(folder: Path, **environment: str) -> subprocess.Popen:
    """A process that compiles a small program with the cache in a folder."""
    inherited = {name: value for name, value in os.environ.items() if name != "JAX_COMPILATION_CACHE_DIR"}
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(folder)],
        cwd=ROOT,
        env=inherited | {SECONDS: "0"} | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def ended(process: subprocess.Popen) -> tuple[str | None, int, int, float]:
    """Folder in use, programs taken from it, programs put there, and the program's value."""
    out, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    return tuple(json.loads(out))


@pytest.fixture(scope="module")
def filled(tmp_path_factory) -> tuple[Path, int, float]:
    """A folder with the programs of a process, how many these are, and the value."""
    root = tmp_path_factory.mktemp("filled")
    folder, hits, stored, value = ended(started(root))
    assert Path(folder).parent == root
    assert hits == 0 and stored > 0
    return root, stored, value


@pytest.fixture
def fresh(monkeypatch):
    """JAX as if no cache had been chosen; afterwards as it was."""
    before = {name: getattr(jax.config, name) for name in SETTINGS}
    jax.config.update("jax_compilation_cache_dir", None)
    monkeypatch.delenv(SECONDS, raising=False)
    monkeypatch.delenv("DRIVETWIN_COMPILE_CACHE", raising=False)
    yield
    for name, value in before.items():
        jax.config.update(name, value)


def test_the_next_process_takes_its_programs_from_the_folder(filled):
    root, stored, value = filled
    assert ended(started(root))[1:] == (stored, 0, value)


def test_two_processes_may_fill_the_folder_at_once(tmp_path):
    pair = [started(tmp_path) for _ in range(2)]
    (folder, _, _, value), (other, _, _, same) = [ended(process) for process in pair]
    assert (folder, value) == (other, same)


@pytest.mark.parametrize("damage", [lambda data: data[: len(data) // 2], lambda data: b"no program", lambda data: b""])
def test_damaged_entries_do_no_harm(filled, tmp_path, damage):
    root, stored, value = filled
    copy = shutil.copytree(root, tmp_path / "copy")
    for file in copy.glob("*/*-cache"):
        file.write_bytes(damage(file.read_bytes()))
    assert ended(started(copy))[1:] == (0, stored, value)


def test_empty_entries_are_replaced(fresh, tmp_path):
    empty = Path(use_compile_cache(tmp_path)) / "jit_f-0-cache"
    empty.touch()
    jax.config.update("jax_compilation_cache_dir", None)
    use_compile_cache(tmp_path)
    assert not empty.exists()


def test_the_users_folder_wins(tmp_path):
    mine = tmp_path / "mine"
    folder, _, stored, _ = ended(started(tmp_path / "other", JAX_COMPILATION_CACHE_DIR=str(mine)))
    assert folder == str(mine)
    assert len(list(mine.glob("*-cache"))) == stored > 0
    assert not (tmp_path / "other").exists()


def test_a_folder_chosen_in_the_program_stays(fresh, tmp_path):
    first = use_compile_cache(tmp_path / "first")
    assert use_compile_cache(tmp_path / "second") == first == jax.config.jax_compilation_cache_dir


def test_the_users_least_time_stays(fresh, tmp_path, monkeypatch):
    before = jax.config.jax_persistent_cache_min_compile_time_secs
    monkeypatch.setenv(SECONDS, str(before))
    use_compile_cache(tmp_path)
    assert jax.config.jax_persistent_cache_min_compile_time_secs == before


def test_programs_below_a_second_are_kept(fresh, tmp_path):
    use_compile_cache(tmp_path)
    assert jax.config.jax_persistent_cache_min_compile_time_secs < 0.2


@pytest.mark.parametrize("word", ["off", "0", " OFF "])
def test_switched_off(fresh, tmp_path, monkeypatch, word):
    monkeypatch.setenv("DRIVETWIN_COMPILE_CACHE", word)
    before = dict(jax.config.values)
    assert use_compile_cache(tmp_path) is None
    assert dict(jax.config.values) == before and not list(tmp_path.iterdir())


def test_switched_off_in_jax(fresh, tmp_path):
    jax.config.update("jax_enable_compilation_cache", False)
    assert use_compile_cache(tmp_path) is None
    assert jax.config.jax_compilation_cache_dir is None


@pytest.mark.parametrize("place", ["file", "file/below"])
def test_without_a_folder_that_can_be_written_there_is_no_cache(fresh, tmp_path, place):
    (tmp_path / "file").write_text("not a folder")
    before = dict(jax.config.values)
    assert use_compile_cache(tmp_path / place) is None
    assert dict(jax.config.values) == before


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="nothing is read-only for this user")
def test_a_read_only_folder_is_no_cache(fresh, tmp_path):
    tmp_path.chmod(0o500)
    assert use_compile_cache(tmp_path) is None


def test_a_full_disk_is_no_error(fresh, tmp_path, monkeypatch):
    def full(**_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(compile_cache.tempfile, "TemporaryFile", full)
    assert use_compile_cache(tmp_path) is None


def test_each_processor_has_its_own_folder(fresh, tmp_path, monkeypatch):
    folders = []
    for flags in ("sse avx2", "sse avx2 avx512f", None):
        cpuinfo = tmp_path / "cpuinfo"
        if flags:
            cores = [f"processor\t: {i}\nmodel name\t: one\ncpu MHz\t: {i}\nflags\t: {flags}" for i in range(2)]
            cpuinfo.write_text("\n\n".join(cores))
        monkeypatch.setattr(compile_cache, "_CPUINFO", cpuinfo if flags else tmp_path / "none")
        jax.config.update("jax_compilation_cache_dir", None)
        folders.append(use_compile_cache(tmp_path / "programs"))
    assert len(set(folders)) == 3
    monkeypatch.setattr(compile_cache, "_CPUINFO", tmp_path / "cpuinfo")
    cpuinfo.write_text(cpuinfo.read_text().replace("cpu MHz\t: 0", "cpu MHz\t: 3000"))
    jax.config.update("jax_compilation_cache_dir", None)
    assert use_compile_cache(tmp_path / "programs") == folders[1]


def test_the_longest_unused_programs_are_dropped_beyond_the_limit(fresh, tmp_path):
    ages = {"jax-1-1-old/jit_a-1-cache": 40, "jax-1-1-old/jit_b-2-cache": 10, "jax-2-2-new/jit_a-1-cache": 20}
    for name, age in (ages | {"jax-1-1-old/notes.txt": 90, "other/jit_a-1-cache": 90}).items():
        file = tmp_path / name
        file.parent.mkdir(exist_ok=True)
        file.write_bytes(b"0" * 100)
        os.utime(file, (1e9 - age, 1e9 - age))
    use_compile_cache(tmp_path, size_limit=250)
    left = {str(file.relative_to(tmp_path)) for file in tmp_path.rglob("*") if file.is_file()}
    assert left == {*list(ages)[1:], "jax-1-1-old/notes.txt", "other/jit_a-1-cache"}


def test_a_limit_that_leaves_nothing(fresh, tmp_path):
    with pytest.raises(InputError, match="size_limit must be positive"):
        use_compile_cache(tmp_path, size_limit=0)


def test_the_command_line_uses_the_users_cache(fresh, tmp_path, monkeypatch):
    from fitting import cli

    monkeypatch.setattr(compile_cache, "user_cache", lambda: tmp_path / "cache")
    monkeypatch.setattr("fitting.rack_pinion_demo.run_demo", lambda out: str(jax.config.jax_compilation_cache_dir))
    assert cli.main(["demo", "--out", str(tmp_path / "out")]) == 0
    assert Path(jax.config.jax_compilation_cache_dir).parent == tmp_path / "cache" / "compiled"
