"""Convert maps and pairs to other files: de-rotated maps, v-disparity images, disparity maps."""
