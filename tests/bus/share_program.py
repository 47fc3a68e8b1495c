"""A program on a shared line that takes commands on standard input, until it is killed.

`python -m tests.bus.share_program PORT FOLDER NAME LATE`; prints `ready`, then a line for each
command: `read REGISTER`, `ask REGISTER`, `write REGISTER VALUE`, `claim DEVICE`. It waits neither
for the reply to `ask` nor for the end of a write.
"""

from __future__ import annotations

import asyncio
import os
import sys
from dataclasses import replace
from pathlib import Path

from tui.bus.line import Line
from tui.bus.link import SerialLink
from tui.bus.program import Program

from .conftest import WIDE
from .sharing import QUICK, place_in


async def main(port: str, folder: str, name: str, late: str) -> None:
    timing = replace(QUICK, late_reply=float(late))
    line = Line(
        SerialLink(port),
        timing=timing,
        place=place_in(Path(folder)),
        program=Program(name, name, os.getpid()),
    )
    line.describe(1, WIDE)
    await asyncio.to_thread(line.open, wait=20)
    print("ready", flush=True)
    works: list[asyncio.Task[object]] = []
    while reported := (await asyncio.to_thread(sys.stdin.readline)).split():
        match reported:
            case ["read", register]:
                await line.read(1, int(register))
            case ["ask", register]:
                works.append(asyncio.create_task(line.read(1, int(register))))
            case ["write", register, value]:
                works.append(asyncio.create_task(line.write(1, int(register), [int(value)])))
            case ["claim", device]:
                line.facts.claim(int(device))
        print("did", *reported, flush=True)
    line.close()


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
