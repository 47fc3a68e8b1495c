"""Requests as frozen values, and what the reply of each must look like."""
