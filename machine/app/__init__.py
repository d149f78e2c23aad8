"""The program: joins the stages and talks to people."""
