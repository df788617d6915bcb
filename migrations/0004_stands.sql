-- Where inspectors stood, with the markers that it may have been; and visits that come from there.

create table stands (
    session_id  text    not null references sessions (id) on delete cascade,
    number      integer not null,   -- counts the stands of a session from 1
    t_start_ns  integer not null,   -- when the feet came to rest
    t_end_ns    integer not null,   -- when the first foot lifted; the latest time known while it lasts
    lasts       integer not null,   -- whether the inspector still stands there
    e_m         real    not null,   -- where the track had it when it was first told
    n_m         real    not null,
    u_m         real    not null,
    candidates  text    not null,   -- JSON as in faults: likeliest first; marker null is "none of them"
    primary key (session_id, number)
) strict, without rowid;

-- Who said that it was this marker: somebody keyed it in, chose it among a stand's candidates, or
-- automatic mode was nearly certain.
alter table visits add column origin text not null default 'keyed'
    check (origin in ('keyed', 'chosen', 'automatic'));

-- Whether a stand that is nearly certain is taken for a visit.
alter table sessions add column automatic_visits integer not null default 0;

-- Stands whose automatic visit was undone: they are left to people.
create table undone_stands (
    session_id  text    not null references sessions (id) on delete cascade,
    t_start_ns  integer not null,
    primary key (session_id, t_start_ns)
) strict, without rowid;
