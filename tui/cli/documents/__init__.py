"""The documents that `--json` prints, field by field, and their JSON Schema."""
