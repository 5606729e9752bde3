"""Study files: a drive, its data and a question in one TOML file, and the runs that answer it."""
