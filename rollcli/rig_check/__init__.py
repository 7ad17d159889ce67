"""What `rollcli rig` does: results to an assessment of the rig, its checks, and the table."""
