//! From a job to an ordered list of work units and shards; pure, no I/O.
