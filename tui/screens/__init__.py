"""The screens of the panel, one module each; they never hold a register number."""
