"""A simulated drive as a Modbus server: functions, access, conversation, endpoints."""
