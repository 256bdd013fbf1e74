//! What is on disk: records, their protobuf codec and schema, the format's number.
