lodestone: A subcommand is required (see lodestone --help, or lodestone SUBCOMMAND --help)
