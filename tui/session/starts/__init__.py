"""Records of motor starts, written before the run frame is sent."""
