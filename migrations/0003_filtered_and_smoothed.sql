-- The main run of a finished session is smoothed; what the filter told is kept beside it, to compare.
-- SQLite changes no check in place, so the table is written anew.

create table track_points_with_filtered (
    session_id         text    not null references sessions (id) on delete cascade,
    run                text    not null check (run in ('main', 'filtered', 'without_markers')), -- with every aid, smoothed once finished; the same before smoothing; or with no visit used
    t_ns               integer not null,
    e_m                real    not null,   -- the middle of the feet (the one foot, when there is one)
    n_m                real    not null,
    u_m                real    not null,
    heading_rad        real    not null,   -- clockwise from true north, in (−π, π]
    sigma_heading_rad  real    not null,
    sigma_e_m          real    not null,
    sigma_n_m          real    not null,
    sigma_u_m          real    not null,
    covariance_en_m2   real    not null,   -- of east and north, m²
    left_e_m           real,               -- the left sensor; null when that foot carries none
    left_n_m           real,
    left_u_m           real,
    right_e_m          real,               -- the right sensor; null when that foot carries none
    right_n_m          real,
    right_u_m          real,
    left_stance        integer,            -- whether that foot stands; null with its position
    right_stance       integer,
    primary key (session_id, run, t_ns)
) strict, without rowid;
insert into track_points_with_filtered select * from track_points;
drop table track_points;
alter table track_points_with_filtered rename to track_points;
