-- The batches of a stream are found by session and number; the feet of one session go on side by side, on one page of
-- the index rather than on two.
drop index raw_chunks_of_stream;
create unique index raw_chunks_of_stream on raw_chunks (session_id, first_sequence, foot) where log_id is null;

-- `encoding` of new raw_chunks is 2: by columns, as server/src/store/sample_columns.rs tells it; chunks of encoding 1 stay
-- as they are.
