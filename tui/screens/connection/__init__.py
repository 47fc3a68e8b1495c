"""Line: choosing a line, finding its drives."""
