"""What people read: the study's figures and the typeset ``study.pdf``. All plotting lives here."""
