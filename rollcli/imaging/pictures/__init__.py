"""Pictures for people: maps and roads in colour, v-disparity with labelled margins."""
