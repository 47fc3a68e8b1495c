"""The shared line: one owner of a Modbus line, asked by everybody else. Knows no drive."""
