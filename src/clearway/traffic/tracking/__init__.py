"""Reports screened and made into tracks."""
