"""The shared line: one owner of a Modbus line, which serves all requests. Knows no drive."""
