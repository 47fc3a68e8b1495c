"""The key that sets the inputs of a simulated drive, as a hand at its terminals would."""

from __future__ import annotations

from .run_keys import RunKeys

NOT_SIMULATED = "Inputs are set at the terminals; this panel sets only those of a simulated drive."
LOOKS_LIKE = "LI1=1,AI1=5V: logic inputs 1 or 0, analog 5V, 12mA, 50%."


class InputKeys(RunKeys):
    """Keys that set the inputs of a simulated drive by a text."""

    def action_inputs(self) -> None:
        """Ask for inputs and set them; a real line has none that can be set from here."""
        simulation = self.app.opened.simulation if self.app.opened else None
        if simulation is None:
            self.app.notify(NOT_SIMULATED, severity="warning")
            return
        from tui.simulator import SimulatorError, check_inputs, set_inputs

        from ..dialogs.ask import Ask

        device = self.session.device

        def fault(text: str) -> str:
            try:
                check_inputs(simulation, f"{device}: {text}")
            except SimulatorError as error:
                return str(error)
            return ""

        def reported(text: str | None) -> None:
            if text is not None:
                self.app.notify(f"Simulated inputs, {set_inputs(simulation, f'{device}: {text}')}")

        question = f"Inputs of the simulated drive {device}"
        about = f"{simulation.drive(device).terminals.reported()}\n{LOOKS_LIKE}"
        requested = Ask(question, fault, about=about, takes="Set", number=True)
        self.app.push_screen(requested, reported)
