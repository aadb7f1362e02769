"""What the rostests share: waiting for conditions, processes of their own, a player of recorded bags."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import threading
import time
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Optional
from xmlrpc.client import ServerProxy

import rosbag
import rosgraph
import rospy
from rosgraph_msgs.msg import Clock, Log

REPO = Path(__file__).resolve().parents[2]


def wait_until(condition: Callable[[], Any], timeout_s: float) -> bool:
    """Whether the condition came true in time, by the wall clock: /clock may stand still."""
    end_s = time.monotonic() + timeout_s
    while time.monotonic() < end_s:
        if condition():
            return True
        time.sleep(0.02)
    return bool(condition())


@contextlib.contextmanager
def part(name: str) -> Iterator[None]:
    """A part of a test that is named where it fails; rosunit counts what fails in a subTest and does not show it."""
    try:
        yield
    except Exception as err:
        raise AssertionError(f"{name}: {type(err).__name__}: {err}") from err


def data_dir() -> Optional[Path]:
    """The folder of recorded logs; None if it is not on this machine."""
    folder = Path(os.environ.get("GLASS_NAV_DATA") or REPO.parent / "shared" / "data")
    return folder if (folder / "logs").is_dir() else None


def process_of(node: str) -> int:
    """The number of the process of a running node."""
    uri = rosgraph.Master(rospy.get_name()).lookupNode(node)
    code, message, pid = ServerProxy(uri).getPid(rospy.get_name())
    assert code == 1, message
    return int(pid)


def busy_threads(pid: int) -> int:
    """How many threads of a process used more than a quarter of the CPU time that all of them used."""
    stats = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # a thread that has ended since
            stats.append((task / "stat").read_text())
    ticks = [sum(map(int, stat.rpartition(")")[2].split()[11:13])) for stat in stats]  # user, system
    return sum(each > 0.25 * sum(ticks) for each in ticks)


class Heard:
    """The messages of one topic, kept in the order in which they came."""

    def __init__(self, topic: str, kind: type, keep: Callable[[Any], bool] = lambda msg: True) -> None:
        self._messages: List[Any] = []
        self._keep = keep
        self._subscriber = rospy.Subscriber(topic, kind, self._store, queue_size=1000, tcp_nodelay=True)

    def _store(self, msg: Any) -> None:
        if self._keep(msg):
            self._messages.append(msg)

    @property
    def all(self) -> List[Any]:
        return list(self._messages)

    @property
    def last(self) -> Any:
        return self._messages[-1] if self._messages else None

    def clear(self) -> None:
        self._messages = []

    def __len__(self) -> int:
        return len(self._messages)


class LogLines(Heard):
    """What nodes say on /rosout."""

    def __init__(self) -> None:
        super().__init__("/rosout", Log)

    def having(self, *words: str) -> List[str]:
        """The lines that hold all of the words."""
        return [msg.msg for msg in self.all if all(word in msg.msg for word in words)]


class Process:
    """A program of the package, ended by its own id."""

    def __init__(self, script: str, *arguments: str) -> None:
        self._process = subprocess.Popen(
            [str(REPO / "scripts" / script), *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def end(self, how: int = signal.SIGINT, timeout_s: float = 15.0) -> "tuple[int, str]":
        """Exit code and everything it printed."""
        if self._process.poll() is None:
            self._process.send_signal(how)
        return self.wait(timeout_s)

    def wait(self, timeout_s: float = 15.0) -> "tuple[int, str]":
        """Exit code and everything it printed, once it ends by itself."""
        try:
            printed, _ = self._process.communicate(timeout=timeout_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()
            raise
        return self._process.returncode, printed


class BagPlayer:
    """Publishes some topics of a bag, with /clock, at a steady pace."""

    def __init__(self, path: Path, kinds: Dict[str, type], duration_s: float, speed: float) -> None:
        with rosbag.Bag(str(path)) as bag:
            start = rospy.Time(bag.get_start_time())
            self.messages = [
                (t, topic, self._as(kinds[topic], msg))
                for topic, msg, t in bag.read_messages(topics=list(kinds), end_time=start + rospy.Duration(duration_s))
            ]
        self._speed = speed
        self._clock = rospy.Publisher("/clock", Clock, queue_size=100, tcp_nodelay=True)
        self._publishers = {
            topic: rospy.Publisher(topic, kind, queue_size=100, tcp_nodelay=True) for topic, kind in kinds.items()
        }

    @staticmethod
    def _as(kind: type, msg: Any) -> Any:
        """rosbag makes classes of its own from the bag; publishers want those of the system."""
        if isinstance(msg, kind):
            return msg
        from io import BytesIO

        raw = BytesIO()
        msg.serialize(raw)
        return kind().deserialize(raw.getvalue())

    def connected(self) -> bool:
        """Somebody listens on each topic."""
        return all(p.get_num_connections() for p in [self._clock, *self._publishers.values()])

    def set_clock(self) -> None:
        """Time is that of the first message."""
        self._clock.publish(Clock(self.messages[0][0]))

    def play(self) -> threading.Thread:
        """Start; join the thread to wait for the end."""
        thread = threading.Thread(target=self._play, daemon=True)
        thread.start()
        return thread

    def _play(self) -> None:
        start, start_s = self.messages[0][0], time.monotonic()
        for stamp, topic, msg in self.messages:
            time.sleep(max(0.0, start_s + (stamp - start).to_sec() / self._speed - time.monotonic()))
            self._clock.publish(Clock(stamp))
            self._publishers[topic].publish(msg)
