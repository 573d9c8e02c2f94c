"""Campaigns and fleets of the plant that ships, `irtwin.demo.plant`, and robots that are drawn for this bench."""
