"""Modbus TCP for programs of others: frames in, answers out; what is answered is not known here."""
