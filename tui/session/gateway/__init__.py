"""Line for Modbus TCP clients: the drive of a request, allowed writes, and replies."""
