"""What OpenCV does for us: stereo matching, de-rotation, v-disparity images."""
