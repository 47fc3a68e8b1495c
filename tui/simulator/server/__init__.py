"""Modbus server of a simulated drive: functions, access, conversation, endpoints."""
