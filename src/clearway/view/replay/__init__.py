"""A flight to look at again: written as one MCAP file, read back, shown as one page.

`writing` and `reading` own the file, `messages` what stands in it, `page` and `serving` the view in
the browser, whose own parts lie in the folder `page/`.
"""
