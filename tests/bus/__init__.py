"""Tests of the shared line, against scripted peers on pseudo-terminals and loopback TCP."""
