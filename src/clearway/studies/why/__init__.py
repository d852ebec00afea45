"""Why a recorded flight went wrong: evidence of its log, its cause, what clearway had flown."""
