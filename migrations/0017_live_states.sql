-- The states of live walks: a server that starts again takes one up and goes over some minutes of the walk in place of all
-- of it. Nothing in here is the truth: without it the walk is made from its samples.
create table live_states (
    id                   integer not null primary key,
    session_id           text    not null references sessions (id) on delete cascade,
    t_ns                 integer not null,  -- since when the state knows its past, ns
    fits                 text    not null,  -- hash of the program that saved it and of what the walk was told
    samples              integer not null,  -- taken before, both feet
    next_sequence_left   integer not null,  -- the batches that were not taken yet begin here
    next_sequence_right  integer not null,
    body                 blob    not null   -- for that program alone
) strict;
create unique index live_states_of_session on live_states (session_id, t_ns);

-- A visit that is taken back is in every state that was saved since it was told: the walk is then made from its samples.
create trigger live_states_go_with_a_visit after delete on stream_visits begin
    delete from live_states where session_id = old.session_id;
end;
