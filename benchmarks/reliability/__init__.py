"""Whether anything is lost, mixed up or believed when inputs are hostile, disks fail and processes are killed."""
