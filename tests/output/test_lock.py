"""One process at a time writes into a folder, and a crash never leaves one shut."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from taichi_sph.errors import SceneError
from taichi_sph.output import lock
from taichi_sph.output.lock import LOCK_FILE, locked

HOLDER = """
import sys, time
from pathlib import Path
from taichi_sph.output.lock import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(100)
"""


@pytest.fixture
def holder(tmp_path: Path):
    """Another process that holds the lock of tmp_path/r."""
    process = subprocess.Popen([sys.executable, "-c", HOLDER, str(tmp_path / "r")], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.wait()


def taken(folder: Path) -> list[str]:
    """What is said when the lock is taken."""
    said: list[str] = []
    with locked(folder, said.append):
        pass
    return said


def test_the_sentence_names_the_process(tmp_path: Path, holder: subprocess.Popen) -> None:
    with pytest.raises(SceneError, match=rf"r' is in use by process {holder.pid} on \S+ since \d{{4}}-\d\d-\d\d \d\d:\d\d:\d\d: wait"):
        taken(tmp_path / "r")
    assert json.loads((tmp_path / "r" / LOCK_FILE).read_text())["process"] == holder.pid  # the file can be read meanwhile


def test_a_killed_process_leaves_the_folder_open(tmp_path: Path, holder: subprocess.Popen) -> None:
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    assert (tmp_path / "r" / LOCK_FILE).exists()
    said = taken(tmp_path / "r")
    assert len(said) == 1 and f"was left locked by process {holder.pid} on " in said[0] and said[0].endswith(", which is gone; going on")
    assert taken(tmp_path / "r") == []


def test_two_in_one_process(tmp_path: Path) -> None:
    with locked(tmp_path / "r"), pytest.raises(SceneError, match=f"process {os.getpid()} "):
        taken(tmp_path / "r")


def test_nothing_is_left(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), locked(tmp_path / "a/b/c"):
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
    with locked(tmp_path / "a/b"):
        (tmp_path / "a/b/mine").touch()
    assert [p.name for p in tmp_path.rglob("*")] == ["a", "b", "mine"]


def test_of_many_that_come_at_once_one_after_the_other_gets_in(tmp_path: Path) -> None:
    """Four processes add ten times to a number in a file, unprotected but for the lock."""
    script = (
        "import sys, time\nfrom pathlib import Path\nfrom taichi_sph.errors import SceneError\nfrom taichi_sph.output.lock import locked\n"
        "folder, until = Path(sys.argv[1]), time.monotonic() + 60\n"
        "for k in range(10):\n"
        "    while time.monotonic() < until:\n"
        "        try:\n"
        "            with locked(folder):\n"
        "                number = int((folder / 'number').read_text())\n"
        "                time.sleep(0.002)\n"
        "                (folder / 'number').write_text(str(number + 1))\n"
        "            break\n"
        "        except SceneError:\n"
        "            time.sleep(0.001)\n"
    )
    (tmp_path / "number").write_text("0")
    both = [subprocess.Popen([sys.executable, "-c", script, str(tmp_path)]) for _ in range(4)]
    assert [process.wait(100) for process in both] == [0] * 4
    assert (tmp_path / "number").read_text() == "40"


def left(folder: Path, **changes: object) -> None:
    """A lock file that somebody left."""
    folder.mkdir(exist_ok=True)
    (folder / LOCK_FILE).write_text(json.dumps(lock._me() | changes))


@pytest.mark.parametrize("content", ["", "{", "[]", '{"process": "x"}', "\0" * 100, "[" * 100_000, '{"process": 1}'])
def test_a_damaged_file_says_nothing(tmp_path: Path, content: str) -> None:
    (tmp_path / LOCK_FILE).write_text(content)
    assert taken(tmp_path) == []


def test_another_start_of_the_machine(tmp_path: Path) -> None:
    left(tmp_path, boot="another")
    assert taken(tmp_path)[0].endswith(", before this machine was started anew; going on")


@pytest.fixture
def no_locks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that knows no locks."""

    def refused(*_: object) -> None:
        raise OSError(lock.errno.ENOLCK, "No locks available")

    monkeypatch.setattr(lock.fcntl, "flock", refused)


def test_where_the_disk_knows_no_locks_the_words_decide(tmp_path: Path, no_locks: None) -> None:
    assert taken(tmp_path / "new") == []
    left(tmp_path)  # this process lives
    with pytest.raises(SceneError, match=f"in use by process {os.getpid()}"):
        taken(tmp_path)
    left(tmp_path, started="1")  # another process had this number
    assert taken(tmp_path)[0].endswith(", which is gone; going on")
    left(tmp_path, boot="another")
    assert taken(tmp_path)[0].endswith(", before this machine was started anew; going on")
    left(tmp_path, host="elsewhere")
    with pytest.raises(SceneError, match=r"process \d+ on elsewhere since .* \(if it is gone: remove '.*\.lock'\)"):
        taken(tmp_path)


def test_a_link_is_not_followed(tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.write_text("mine")
    (tmp_path / "r").mkdir()
    (tmp_path / "r" / LOCK_FILE).symlink_to(precious)
    with pytest.raises(SceneError, match="symbolic link"):
        taken(tmp_path / "r")
    assert precious.read_text() == "mine"


def test_the_holder_may_be_about_to_say_who_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lock, "_PATIENCE", 0.05)
    with locked(tmp_path):
        (tmp_path / LOCK_FILE).write_text("")
        began = time.monotonic()
        with pytest.raises(SceneError, match="in use by another process"):
            taken(tmp_path)
        assert time.monotonic() - began < 5
