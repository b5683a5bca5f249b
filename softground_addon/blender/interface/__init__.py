"""What the user sees and presses: operators, panels, menus and the overlay."""
