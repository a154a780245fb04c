"""The robust mode: evolution in drawn situations, and the champions that ship. On `evolution`."""
