"""From a file's columns to channels in SI."""
