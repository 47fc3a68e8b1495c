"""Values for the plant: Debian's mosquitto and Prometheus, with the settings of docs/plant.md."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from tests.programs import PATIENCE, Served, free_port, served, wait_until
from tui.cli.plant.broker import PASSWORD_SETTING
from tui.cli.plant.mqtt import MQTT_KEEPALIVE
from tui.simulator import DriveSpec

from .conftest import Peer
from .test_commands import bench, turns
from .test_serve import Gateway, serving, started_by_a_client

PAGE = Path(__file__).resolve().parents[2] / "docs" / "plant.md"
ROOT = "plant/hall2"


def printed(kind: str, begins: str) -> str:
    """The block of the page that has these words in its first lines."""
    blocks = re.findall(rf"^```{kind}\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)
    (found,) = (block for block in blocks if begins in block[:80])
    return str(found)


# A broker


@dataclass
class RealBroker:
    """mosquitto with the settings of the page, at its own port."""

    program: str
    folder: Path
    port: int = field(default_factory=free_port)
    process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        log = (self.folder / "log").open("ab")
        command = [self.program, "-v", "-c", str(self.folder / "conf")]
        self.process = subprocess.Popen(command, stdout=log, stderr=log)
        log.close()
        wait_until(lambda: self._runs() or self._ended(), "mosquitto runs")
        assert not self._ended(), (self.folder / "log").read_text("utf-8", "replace")

    def _runs(self) -> bool:
        return self.output("running") > 0

    def _ended(self) -> bool:
        return self.process is None or self.process.poll() is not None

    def end(self) -> None:
        assert self.process is not None
        self.process.terminate()
        self.process.wait(PATIENCE)
        (self.folder / "log").unlink()

    def output(self, text: str) -> int:
        """Count a text in its log."""
        return (self.folder / "log").read_text("utf-8", "replace").count(text)

    def options(self, user: str) -> list[str]:
        return ["-h", "127.0.0.1", "-p", str(self.port), "-u", user, "-P", f"of {user}"]

    def retained(self, topic: str, *options: str) -> dict[str, str]:
        """All retained messages, as scada receives them."""
        reported = ["-v", "-t", topic, "--retained-only", "-W", "1", *options]
        done = subprocess.run(
            ["mosquitto_sub", *self.options("scada"), *reported],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        assert done.returncode in (0, 27), done.stderr
        return dict(line.split(" ", 1) for line in done.stdout.splitlines())

    @property
    def status(self) -> str | None:
        return self.retained(f"{ROOT}/status", "-C", "1").get(f"{ROOT}/status")

    def drive(self) -> dict[str, Any]:
        """The message about the drive; empty where there is none."""
        found = self.retained(f"{ROOT}/+/1", "-C", "1").values()
        return next((json.loads(text) for text in found), {})


@pytest.fixture
def broker(peer: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[RealBroker]:
    """mosquitto, in which drives publishes and scada reads."""
    folder = tmp_path / "mosquitto"
    folder.mkdir()
    made = RealBroker(peer("mosquitto", "mosquitto"), folder)
    make_password = peer("mosquitto_passwd", "mosquitto")
    peer("mosquitto_sub", "mosquitto-clients")
    conf = printed("text", "listener 1883").replace("1883", f"{made.port} 127.0.0.1")
    for path in ("/etc/mosquitto", "/var/lib/mosquitto"):
        conf = conf.replace(path, str(folder))
    # started by root it would become a user who may not look into this folder
    (folder / "conf").write_text(conf + ("user root\n" if os.geteuid() == 0 else ""))
    (folder / "acl").write_text(printed("text", "user drives"))
    (folder / "passwords").touch()
    for user in ("drives", "scada"):
        command = [make_password, "-b", str(folder / "passwords"), user, f"of {user}"]
        subprocess.run(command, check=True, timeout=PATIENCE, capture_output=True)
    monkeypatch.setenv(PASSWORD_SETTING, "of drives")
    made.start()
    yield made
    assert made.process is not None
    made.process.kill()
    made.process.wait(PATIENCE)


@pytest.fixture
def programs() -> Iterator[ExitStack]:
    """Programs that end with the test."""
    with ExitStack() as stack:
        yield stack


def to_broker(broker: RealBroker) -> list[str]:
    return ["--mqtt", f"mqtt://drives@127.0.0.1:{broker.port}/{ROOT}", "--every", "0.2"]


def publishing(programs: ExitStack, broker: RealBroker, *options: str) -> Gateway:
    """`serve` with a gateway, publishing the drive at address 1."""
    simulation, line = programs.enter_context(bench())
    command = serving(f"{line}@1", "--tcp", ":0", *to_broker(broker), *options)
    program = programs.enter_context(served(command, ready="Ready:"))
    wait_until(lambda: broker.drive().get("state") is not None, "a cycle is published")
    return Gateway(simulation, line, program)


def test_cycles_are_retained_and_no_message_writes(
    programs: ExitStack, broker: RealBroker, peer: Peer
) -> None:
    made = publishing(programs, broker, "--allow-writes", "all", "--allow-commands")
    assert broker.status == "online"
    reported = broker.drive()
    assert reported["profile"] == "atv71"
    assert reported["values"]["RFR"]["quality"] == "good"
    assert json.loads(broker.retained(f"{ROOT}/+/line").popitem()[1])["state"] == "connected"

    (topic,) = broker.retained(f"{ROOT}/+/1")
    drive = made.simulation.drive(1)
    before = {code: drive.raw(code) for code in ("CMD", "LFR", "ACC")}
    for name in (topic, f"{topic}/set", f"{topic}/CMD", f"{ROOT}/status"):
        subprocess.run(
            ["mosquitto_pub", *broker.options("drives"), "-t", name, "-m", '{"CMD": 15, "ACC": 1}'],
            check=True,
            timeout=PATIENCE,
        )
    count = broker.output("Received PUBLISH from drivepanel-")
    wait_until(lambda: broker.output("Received PUBLISH from drivepanel-") > count + 3, "it goes on")
    assert {code: drive.raw(code) for code in before} == before
    assert broker.output("Received SUBSCRIBE from drivepanel-") == 0
    wait_until(lambda: broker.status == "online", "it says again that it is there")

    status, output = made.program.end()
    assert (status, output) == (0, "")
    assert broker.status == "offline"


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_last_will_is_published_within_one_and_a_half_keep_alives(
    programs: ExitStack, broker: RealBroker, number: signal.Signals
) -> None:
    made = publishing(programs, broker)
    assert broker.status == "online"
    # the broker decides how long it waits: here 1.5 times the configured time
    assert broker.output(f"k{MQTT_KEEPALIVE}, u'drives'") == 1
    made.program.process.send_signal(number)
    wait_until(lambda: broker.status == "offline", "the will")
    made.program.process.kill()


def test_returning_broker_gets_everything_again(programs: ExitStack, broker: RealBroker) -> None:
    made = publishing(programs, broker)
    broker.end()
    for kept in broker.folder.glob("*.db"):
        kept.unlink()
    with made.client() as client:
        assert not client.read_holding_registers(3201, count=1, device_id=1).isError()
    broker.start()
    wait_until(lambda: broker.status == "online", "it is there again")
    assert broker.drive()["values"]["RFR"]["quality"] == "good"
    assert len(broker.retained(f"{ROOT}/#")) == 3
    status, output = made.program.end()
    assert status == 0
    assert "Retrying." in output
    assert "is connected again." in output


def test_publish_beside_serve_uses_the_named_codes(programs: ExitStack, broker: RealBroker) -> None:
    simulation, line = programs.enter_context(bench())
    programs.enter_context(served(serving(line), ready="Ready:"))
    command = [*serving()[:-1], "publish", line, "ACC", *to_broker(broker)]
    program = programs.enter_context(served(command, ready="Ready:"))
    wait_until(lambda: bool(broker.drive().get("values")), "a cycle is published")
    assert list(broker.drive()["values"]) == ["ACC"]
    assert broker.drive()["values"]["ACC"]["raw"] == simulation.drive(1).raw("ACC")
    assert program.end(signal.SIGINT)[0] == 130
    assert broker.status == "offline"


def test_wrong_password_is_reported(
    programs: ExitStack, broker: RealBroker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(PASSWORD_SETTING, "another")
    _, line = programs.enter_context(bench())
    command = serving(f"{line}@1", *to_broker(broker))
    program = programs.enter_context(served(command, ready="Ready:"))
    wait_until(lambda: broker.output("not authorised") > 0, "it was refused")
    time.sleep(0.2)
    status, output = program.end()
    assert status == 0
    assert "ot authorized" in output or "ot authorised" in output


# Motors of dead clients


def test_publish_does_not_keep_the_motor_of_a_dead_client_running(programs: ExitStack) -> None:
    spec = DriveSpec("atv71", 1, sets={"CHCF": 1, "TTO": 20})
    simulation, line = programs.enter_context(bench(spec))
    options = ["--tcp", "127.0.0.1:0", "--allow-commands", "--metrics", ":0", "--every", "0.2"]
    program = programs.enter_context(served(serving(f"{line}@1", *options), ready="Ready:"))
    made = Gateway(simulation, line, program)
    wait_until(lambda: up(program), "the drive is read")
    started_by_a_client(made)
    wait_until(lambda: not turns(simulation), "its own timeout stops the motor")
    wait_until(lambda: up(program), "it is read again")


@pytest.mark.usefixtures("held_inside")
def test_restarted_serve_does_not_keep_earlier_motors_alive(programs: ExitStack) -> None:
    spec = DriveSpec("atv71", 1, sets={"CHCF": 1, "TTO": 30})
    simulation, line = programs.enter_context(bench(spec))
    options = ["--tcp", "127.0.0.1:0", "--allow-commands", "--metrics", ":0", "--every", "0.2"]
    command = serving(f"{line}@1", *options)
    first = programs.enter_context(served(command, ready="Ready:"))
    wait_until(lambda: up(first), "the drive is read")
    started_by_a_client(Gateway(simulation, line, first))
    first.process.kill()
    first.process.wait(PATIENCE)
    again = programs.enter_context(served(command, ready="Ready:"))
    assert turns(simulation)
    wait_until(lambda: not turns(simulation), "its own timeout stops the motor")
    wait_until(lambda: "fault_info{" in scraped(again), "it is read again")


def test_publish_beside_serve_does_not_keep_orphan_motors_alive(programs: ExitStack) -> None:
    spec = DriveSpec("atv71", 1, sets={"CHCF": 1, "TTO": 50})
    simulation, line = programs.enter_context(bench(spec))
    command = serving(line, "--tcp", "127.0.0.1:0", "--allow-commands")
    made = Gateway(simulation, line, programs.enter_context(served(command, ready="Ready:")))
    broker = f"mqtt://127.0.0.1:{free_port()}"
    command = [*serving()[:-1], "publish", line, "--mqtt", broker, "--every", "0.2"]
    programs.enter_context(served(command, ready="Ready:"))
    started_by_a_client(made)
    wait_until(lambda: not turns(simulation), "its own timeout stops the motor")


def up(program: Served) -> bool:
    return bool(re.search(r"^drivepanel_drive_up\{.*\} 1$", scraped(program), re.M))


def scraped(program: Served) -> str:
    found = re.search(r"http://\S+/metrics", program.ready)
    assert found is not None
    with urllib.request.urlopen(found[0], timeout=PATIENCE) as answer:
        return str(answer.read().decode())


# Prometheus


def test_promtool_accepts_the_metrics(peer: Peer, tmp_path: Path) -> None:
    promtool = peer("promtool", "prometheus")
    rules = tmp_path / "drives.rules.yml"
    rules.write_text(printed("yaml", "drives.rules.yml"), "utf-8")
    config = tmp_path / "prometheus.yml"
    config.write_text(printed("yaml", "# prometheus.yml"), "utf-8")
    with bench(DriveSpec("atv71", 1, run_hz=30)) as (_, line):
        command = serving(f"{line}@1", "--metrics", ":0", "--every", "0.2")
        with served(command, ready="Ready:") as program:
            wait_until(lambda: "value_hertz" in scraped(program), "values are read")
            text = scraped(program)
    for arguments, reported in (
        (["check", "config", str(config)], ""),
        (["check", "rules", str(rules)], ""),
        (["check", "metrics"], text),
    ):
        done = subprocess.run(
            [promtool, *arguments],
            input=reported,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr


def test_prometheus_collects_values_and_a_fault(
    programs: ExitStack, peer: Peer, tmp_path: Path
) -> None:
    prometheus = peer("prometheus", "prometheus")
    simulation, line = programs.enter_context(bench(DriveSpec("atv71", 1, run_hz=30)))
    command = serving(f"{line}@1", "--metrics", ":0", "--every", "0.2")
    program = programs.enter_context(served(command, ready="Ready:"))
    port = re.search(r"http://127\.0\.0\.1:(\d+)/metrics", program.ready)
    assert port is not None
    config = printed("yaml", "# prometheus.yml").replace("9101", port[1]).replace("5s", "1s")
    (tmp_path / "prometheus.yml").write_text(config, "utf-8")
    (tmp_path / "drives.rules.yml").write_text(printed("yaml", "drives.rules.yml"), "utf-8")
    at = f"127.0.0.1:{free_port()}"
    process = subprocess.Popen(
        [
            prometheus,
            f"--config.file={tmp_path / 'prometheus.yml'}",
            f"--storage.tsdb.path={tmp_path / 'data'}",
            f"--web.listen-address={at}",
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    programs.callback(process.wait, PATIENCE)
    programs.callback(process.kill)

    def requested(query: str) -> list[Any]:
        try:
            with urllib.request.urlopen(f"http://{at}/api/v1/query?query={query}") as answer:
                return list(json.load(answer)["data"]["result"])
        except (urllib.error.URLError, ConnectionError):
            return []

    wait_until(lambda: bool(requested("drivepanel_value_hertz")), "Prometheus has a frequency")
    values = requested('drivepanel_value_hertz{quantity="output_frequency"}')
    assert float(values[0]["value"][1]) == pytest.approx(30, abs=31)
    simulation.drive(1).provoke("OHF")
    wait_until(lambda: bool(requested("drivepanel_drive_fault_info")), "Prometheus has the fault")
