"""A class with a lock changes its state under the lock only; no thread keeps a program alive.

A test of behavior would notice a missing lock once in thousands of runs, and such a thread only if
its disk or its port hangs.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator

import pytest

from .sources import PACKAGE, calls_of, modules, nodes_of

LOCKS = {"Lock", "RLock", "Condition"}
CHANGES = {
    "add", "append", "appendleft", "clear", "discard", "extend", "insert", "pop", "popitem",
    "popleft", "remove", "setdefault", "update",
}  # fmt: skip
"""Methods of collections that change them."""
ROOMS = ("bus", "keeper", "session")
"""Classes used by several threads: that of the line, those of drives, that of the screen."""

OBJECTS = {"events", "journal", "trace", "_file", "_files", "_trace"}
"""Not collections although they have such methods: logs with their own locks, files, frames."""
WITHOUT_LOCK = {
    "ByteOrder.forget": ("_tested _was_away", "flags, each set in one step"),
    "ByteOrder.note_tested": ("_tested _was_away", "flags, each set in one step"),
    "Commander.run": ("last_run", "replaced as a whole"),
    "Engine._begin": ("_workers", "only the loop of the line changes it"),
    "Engine._end": ("_workers", "only the loop of the line changes it"),
    "Engine._work": ("_main", "only the loop of the line changes it"),
    "Fleet._look_for_left": ("_departed", "replaced as a whole"),
    "BackgroundListener._listen": ("trouble", "replaced as a whole"),
    "BackgroundListener.open": (
        "_families _port_listener _stack _thread link",
        "before its thread begins",
    ),
    "LineRecorder._fail": (
        "_failed _failing_since _reported _retry_at _why",
        "only its own thread sets them",
    ),
    "LineRecorder._file": ("_standing", "only its own thread uses it"),
    "LineRecorder._look_after": ("_flushed _reduced _roomed", "only its own thread uses them"),
    "LineRecorder._make_room": ("_roomed", "only its own thread uses it"),
    "LineRecorder._recover": (
        "_failing_since _waiting _why",
        "set by its own thread; a deque, changed in one step",
    ),
    "LineRecorder._reduce": ("_reduced", "only its own thread uses it"),
    "LineRecorder._rows": ("_standing", "only its own thread uses it"),
    "LineRecorder._settle": ("_lost_then _reported", "only its own thread uses them"),
    "LineRecorder._work": ("_off _waiting", "set once; a deque, emptied in one step"),
    "LineRecorder._write_waiting": (
        "_batch _waiting",
        "used by its own thread; a deque, changed in one step",
    ),
    "LineRecorder.close": ("_closed", "set once"),
    "Journal._count": ("_uncounted eeprom", "only its own thread uses them"),
    "ReplayedRecord._newest_of": ("_newest", "its callers hold the lock"),
    "LineRecorder.note": ("_waiting", "a deque, changed in one step"),
    "LineRecorder.waiting": ("_waiting", "read in one step"),
    "LineWatch._glance": ("_looks", "replaced as a whole"),
    "LineWatch._take_monitored": ("_looks", "replaced as a whole"),
    "LineWatch.recall": ("_looks", "replaced as a whole"),
    "LineWatch.stop": ("_looks", "replaced as a whole"),
    "OrphanMotorGuard._ended_by_loss": ("_lost", "only its own thread uses it"),
    "OrphanMotorGuard._follow": ("_followed", "only its own thread uses it"),
    "OrphanMotorGuard._found": ("_key", "only its own thread uses it"),
    "OrphanMotorGuard._stop": ("_followed", "only its own thread uses it"),
    "Pace.busy": ("_wishes", "read in one step"),
    "Stopper._report": ("_reports _events", "set in one step; a log with a lock of its own"),
    "Stopper.stop": ("_quiet", "one entry, set in one step"),
    "Stopper.reports": ("_reports", "copied in one step"),
    "UnknownDrivePoller.stop": ("_workers", "copied in one step"),
    "WorkQueue.busy_for": ("_waiting", "copied in one step"),
    "WorkQueue.report": ("outcome", "replaced as a whole"),
}
"""By method: what it changes or reads without the lock of its class, and why that is safe."""


def _own(node: ast.AST) -> str:
    """The attribute of self that a node names, or nothing."""
    match node:
        case ast.Attribute(value=ast.Name(id="self"), attr=name):
            return name
    return ""


def locks_of(tree: ast.ClassDef) -> set[str]:
    """The attributes of a class that are locks between threads."""
    found = set()
    for node in ast.walk(tree):
        match node:
            case ast.Assign(targets=[target], value=ast.Call(func=function)):
                module, _, name = ast.unparse(function).rpartition(".")
                if name in LOCKS and module in ("", "threading"):
                    found.add(_own(target))
    return found - {""}


def _outside(node: ast.AST, locks: set[str], *, held: bool = False) -> Iterator[ast.AST]:
    """A node and all in it that does not run in a block that holds a lock."""
    match node:
        case ast.With(items=items) if any(_own(item.context_expr) in locks for item in items):
            held = True
        case ast.Call(func=ast.Attribute(attr="wait_for")) if held:
            return
        case ast.Lambda() | ast.FunctionDef() | ast.AsyncFunctionDef():
            held = False  # it may run at any time
    if not held:
        yield node
    for child in ast.iter_child_nodes(node):
        yield from _outside(child, locks, held=held)


def _changed(node: ast.AST, *, in_place: bool = False) -> Iterator[str]:
    """The attributes of self that a node changes, or those collections that it changes."""
    match node:
        case ast.Call(func=ast.Attribute(value=owner, attr=name)) if name in CHANGES:
            yield _own(owner)
        case ast.Subscript(value=owner, ctx=ast.Store() | ast.Del()):
            yield _own(owner)
        case ast.Attribute(ctx=ast.Store() | ast.Del()) if not in_place:
            yield _own(node)


def _called(nodes: Iterable[ast.AST]) -> set[str]:
    return {_own(node.func) for node in nodes if isinstance(node, ast.Call)}


def without_lock(tree: ast.ClassDef) -> dict[str, set[str]]:
    """By method: what it changes without the lock of its class, and collections that it reads so.

    A private method holds the lock if each method that calls it does.
    """
    locks = locks_of(tree)
    parts = [part for part in tree.body if isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef)]
    outside = {part.name: list(_outside(part, locks)) for part in parts if part.name != "__init__"}
    functions = {node.func for node in ast.walk(tree) if isinstance(node, ast.Call)}
    handed_out = {_own(node) for node in ast.walk(tree) if node not in functions}
    inner = {name for name in _called(ast.walk(tree)) - handed_out if name.startswith("_")}
    free = set(outside) - inner
    while further := {name for caller in free for name in _called(outside[caller]) & inner} - free:
        free |= further & set(outside)
    methods = [part for part in parts if part.name != "__init__"]
    nodes = [node for method in methods for node in ast.walk(method)]
    in_place = {name for node in nodes for name in _changed(node, in_place=True)} - OBJECTS
    found = {}
    for name in free & set(outside):
        changed = {attribute for node in outside[name] for attribute in _changed(node)}
        used = changed | {_own(node) for node in outside[name]} & in_place
        if used := used - OBJECTS - {""}:
            found[f"{tree.name}.{name}"] = used
    return found


def test_class_with_a_lock_changes_state_only_under_it() -> None:
    classes = [
        node
        for room in ROOMS
        for path in modules(PACKAGE / room)
        for node in nodes_of(path)
        if isinstance(node, ast.ClassDef) and locks_of(node)
    ]
    assert len(classes) >= 20
    found = {name: used for node in classes for name, used in without_lock(node).items()}
    assert found == {name: set(used.split()) for name, (used, _) in WITHOUT_LOCK.items()}


def test_threads_do_not_block_the_exit() -> None:
    keeping = set()
    for path, call in calls_of("Thread"):
        daemon = next((word.value for word in call.keywords if word.arg == "daemon"), None)
        if not (isinstance(daemon, ast.Constant) and daemon.value is True):
            keeping.add(path.relative_to(PACKAGE).as_posix())
    # one stops motors when its program ends, and the callers of the other one choose
    assert keeping == {"cli/shared/signals.py", "terminal/last_words.py"}


NAME_ARGUMENT = {"Thread": 2, "spawn": 1}
"""Index of the name among the positional arguments, of a thread and of a worker."""


def _name_of(call: ast.Call, place: int) -> ast.expr | None:
    """The name that a call gives a thread or a worker, by keyword or at `place`."""
    named = [word.value for word in call.keywords if word.arg == "name"]
    return named[0] if named else call.args[place] if len(call.args) > place else None


def test_target_of_a_thread_is_not_its_name() -> None:
    call = ast.parse("Thread(None, work)", mode="eval").body
    assert isinstance(call, ast.Call)
    assert _name_of(call, NAME_ARGUMENT["Thread"]) is None


@pytest.mark.parametrize("begins", NAME_ARGUMENT)
def test_each_thread_and_worker_has_a_name_for_the_log(begins: str) -> None:
    calls = [(path, call) for path, call in calls_of(begins) if path.name != "fake.py"]
    assert len(calls) > 5
    for path, call in calls:
        name = _name_of(call, NAME_ARGUMENT[begins])
        is_empty = name is None or (isinstance(name, ast.Constant) and not name.value)
        assert not is_empty, f"{path}:{call.lineno}"


BOX = """
class Box:
    def __init__(self):
        self._lock = threading.Lock()
        self._kept = []
        self._last = None
    def keep(self, new):
        with self._lock:
            self._kept.append(new)
            self._trim()
    def _trim(self):
        del self._kept[3:]
        self._last = self._kept[-1]
    def all(self):
        with self._lock:
            return list(self._kept)
    def last(self):
        return self._last
"""


KEEPS = {"keep": "_kept", "_trim": "_kept _last"}


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("last(self):", "last(self):", {}),
        ("with self._lock:\n            self", "if 1:\n            self", KEEPS),
        ("with self._lock:\n            return", "if 1:\n            return", {"all": "_kept"}),
        ("            self._trim()", "        self._trim()", {"_trim": "_kept _last"}),
        ("return self._last", "self._last = None", {"last": "_last"}),
        ("return self._last", "self._kept[0] = 1", {"last": "_kept"}),
        ("return self._last", "self._trim()", {"_trim": "_kept _last"}),
        ("return self._last", "return self._trim", {"_trim": "_kept _last"}),
        ("return list(self._kept)", "return lambda: self._trim()", {"_trim": "_kept _last"}),
    ],
)
def test_use_without_the_lock_is_found(old: str, new: str, found: dict[str, str]) -> None:
    assert BOX.count(old) == 1
    (box,) = ast.parse(BOX.replace(old, new)).body
    assert isinstance(box, ast.ClassDef)
    assert without_lock(box) == {f"Box.{name}": set(used.split()) for name, used in found.items()}
