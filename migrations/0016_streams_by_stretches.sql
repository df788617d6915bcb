-- The samples of live streams in a table of their own, in the order in which they were written, whosesoever they are. Their
-- index goes on at its end for all sessions together: by stretches of 4,096 chunks, in each by session. So a commit of a
-- thousand walks touches some dozens of its pages in place of one for each walk. `raw_chunks` keeps what came in logs.
create table stream_chunks (
    id              integer not null primary key, -- in the order of writing
    session_id      text    not null,    -- no foreign key: stream_stretches has it, and takes the chunks along
    foot            text    not null check (foot in ('left', 'right')),
    first_sequence  integer not null,    -- number of its first batch
    sequences       integer not null,    -- how many batches it holds, at least 1
    t_first_ns      integer not null,    -- time of its first sample, ns
    samples         integer not null,    -- how many samples
    encoding        integer not null,    -- as in raw_chunks
    body            blob    not null     -- the samples in that layout
) strict;
create unique index stream_chunks_by_stretch on stream_chunks (id >> 12, session_id, first_sequence, foot);

-- In which parts of stream_chunks a session has chunks: parts of 1,048,576, each of 256 stretches.
create table stream_parts (
    session_id  text    not null references sessions (id) on delete cascade,
    part        integer not null,        -- id >> 20 of its chunks
    primary key (session_id, part)
) strict, without rowid;
create trigger stream_chunks_go_with_their_session after delete on stream_parts begin
    delete from stream_chunks where session_id = old.session_id and id >> 12 in (
        with recursive stretch (n) as (
            select old.part << 8 union all select n + 1 from stretch where n < (old.part << 8) + 255
        ) select n from stretch);
end;

insert into stream_chunks (session_id, foot, first_sequence, sequences, t_first_ns, samples, encoding, body)
    select session_id, foot, first_sequence, sequences, t_first_ns, samples, encoding, body
    from raw_chunks where log_id is null order by id;
insert into stream_parts (session_id, part) select distinct session_id, id >> 20 from stream_chunks;
delete from raw_chunks where log_id is null;
drop index raw_chunks_of_stream;
