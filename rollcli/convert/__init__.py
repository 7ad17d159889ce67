"""Maps and pairs to other files, one for one: de-rotated maps, v-disparity images, disparity maps."""
