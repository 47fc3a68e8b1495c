"""Defects of published data: metrics, messages for a broker."""

from __future__ import annotations

from .defect import Defect

METRICS = "tests/cli/test_metrics.py"
MQTT = "tests/cli/test_mqtt_connections.py"
BYSTANDER = "tests/session/test_bystander.py"

DEFECTS = (
    Defect(
        "plant-feeds-a-dead-commanders-motor",
        "tui/session/sharing/observer_poller.py",
        "return self._silence() > timeout + ACTED_AFTER",
        "return True",
        "A graph keeps a motor running whose controller has died.",
        (BYSTANDER,),
    ),
    Defect(
        "plant-feeds-what-an-ended-program-left",
        "tui/session/sharing/observer_poller.py",
        "if sign is None and not self.orphan:",
        "if sign is None:",
        "A restarted service keeps the motor of its predecessor running.",
        (BYSTANDER,),
    ),
    Defect(
        "plant-asks-though-held-back",
        "tui/session/monitor/monitor.py",
        "if why := self.pause_reason():",
        'if why := "":',
        "A monitor polls a drive whose polling is paused.",
        ("tests/session/test_monitor_faults.py",),
    ),
    Defect(
        "any-client-is-a-sign-of-life",
        "tui/session/gateway/commanding.py",
        "if self._by.get(device) == client:",
        "if True:",
        "A SCADA system that reads is taken for the controller that died.",
        ("tests/session/test_gateway.py",),
    ),
    Defect(
        "old-value-in-a-graph",
        "tui/cli/plant/metrics.py",
        "if not good:",
        "if False:",
        "A graph shows the last value of a drive that no longer answers.",
        (METRICS,),
    ),
    Defect(
        "old-cycle-for-good",
        "tui/cli/plant/status.py",
        "if session is not None and cycle.is_stale(now):",
        "if False:",
        "Values stay good although no program reads the drive any longer.",
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
        "broker-not-updated-after-a-restart",
        "tui/cli/plant/mqtt.py",
        "sent: dict[str, str] = {}",
        'sent: dict[str, str] = self.__dict__.setdefault("_sent", {})',
        "A restarted broker never receives values that have not changed.",
        (MQTT,),
    ),
    Defect(
        "no-last-will",
        "tui/cli/plant/mqtt.py",
        "will=aiomqtt.Will(will, OFFLINE, qos=1, retain=True),",
        "will=None,",
        "The broker shows a killed program as online.",
        (MQTT,),
    ),
    Defect(
        "password-on-the-command-line",
        "tui/cli/plant/broker.py",
        "if parts.password is not None:",
        "if False:",
        "Every user of the computer can read the password for the broker.",
        ("tests/cli/test_mqtt.py",),
    ),
    Defect(
        "named-drive-forgotten",
        "tui/cli/shared/served_lines.py",
        "own = (named.device,) if named.device is not None else ()",
        "own = ()",
        "`serve` ignores the drive of a line's name.",
        ("tests/cli/test_serve.py",),
    ),
)
