"""The command `w2b`: one entry in `commands.COMMANDS` is one subcommand."""
