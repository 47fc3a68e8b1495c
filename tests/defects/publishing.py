"""Defects of what goes out to the plant: metrics, messages for a broker."""

from __future__ import annotations

from .defect import Defect

METRICS = "tests/cli/test_metrics.py"
MQTT = "tests/cli/test_mqtt.py"
BYSTANDER = "tests/session/test_bystander.py"

DEFECTS = (
    Defect(
        "plant-feeds-a-dead-commanders-motor",
        "tui/session/sharing/observer_poller.py",
        "return self._silence() > timeout + ACTED_AFTER",
        "return True",
        "A motor whose controller died runs on for the sake of a graph.",
        (BYSTANDER,),
    ),
    Defect(
        "plant-feeds-what-an-ended-program-left",
        "tui/session/sharing/observer_poller.py",
        "if sign is None and not self.orphan:",
        "if sign is None:",
        "A service that comes back keeps the motor of the one before running.",
        (BYSTANDER,),
    ),
    Defect(
        "plant-asks-though-held-back",
        "tui/session/monitor/monitor.py",
        "if why := self.held_back():",
        'if why := "":',
        "A monitor asks a drive that it is to leave alone.",
        ("tests/session/test_monitor_faults.py",),
    ),
    Defect(
        "any-client-is-a-sign-of-life",
        "tui/session/gateway/commanding.py",
        "if self._by.get(device) == client:",
        "if True:",
        "A SCADA that reads is taken for the controller that died.",
        ("tests/session/test_gateway.py",),
    ),
    Defect(
        "old-value-in-a-graph",
        "tui/cli/plant/metrics.py",
        "if not good:",
        "if False:",
        "A graph shows the last value of a drive that is gone.",
        (METRICS,),
    ),
    Defect(
        "old-cycle-for-good",
        "tui/cli/plant/status.py",
        "if session is not None and cycle.is_stale(now):",
        "if False:",
        "Values stay good though nobody reads the drive any more.",
        (METRICS,),
    ),
    Defect(
        "label-unescaped",
        "tui/cli/plant/metrics.py",
        'return text.replace("\\\\", r"\\\\").replace("\\n", r"\\n").replace(\'"\', r"\\"")',
        "return text",
        "A fault with quotes in its name makes all metrics unreadable.",
        (METRICS,),
    ),
    Defect(
        "broker-not-told-anew",
        "tui/cli/plant/mqtt.py",
        "sent: dict[str, str] = {}",
        'sent: dict[str, str] = self.__dict__.setdefault("_sent", {})',
        "A broker that was restarted never hears of what has not changed.",
        (MQTT,),
    ),
    Defect(
        "no-last-will",
        "tui/cli/plant/mqtt.py",
        "will=aiomqtt.Will(will, OFFLINE, qos=1, retain=True),",
        "will=None,",
        "A program that was killed stays online at the broker.",
        (MQTT,),
    ),
    Defect(
        "password-on-the-command-line",
        "tui/cli/plant/broker.py",
        "if parts.password is not None:",
        "if False:",
        "Every user of the computer reads the password for the broker.",
        (MQTT,),
    ),
    Defect(
        "named-drive-forgotten",
        "tui/cli/shared/served_lines.py",
        "own = (named.device,) if named.device is not None else ()",
        "own = ()",
        "A line's name does not bring its drive to serve.",
        ("tests/cli/test_serve.py",),
    ),
)
