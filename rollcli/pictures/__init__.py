"""What people look at: de-rotated maps, v-disparity, roads in colour, heights over the road."""
