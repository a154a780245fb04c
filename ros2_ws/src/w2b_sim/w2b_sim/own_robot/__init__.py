"""The maker's tools, `w2b robot`: draft a robot's file, check it, let it stand, export it."""
