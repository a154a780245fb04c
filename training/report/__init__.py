"""A study's report: statistics, figures, findings and tables. On `study` and `evolution`."""
