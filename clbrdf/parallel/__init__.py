"""Work over processes: a `map` that the fit takes, children that end with their parent, one way to end."""
