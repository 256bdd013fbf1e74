//! Datasets: MCAP shards, manifest, index, reader, verification.
