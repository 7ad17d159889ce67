"""The commands of `rollcli evaluate`, one file each."""
