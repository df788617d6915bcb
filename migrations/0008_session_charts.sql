-- What the charts of a processed session are drawn from: each series as the smallest and largest value in
-- every cell of a grid in time. Made again with the track; the samples themselves stay in `raw_chunks`.

create table session_charts (
    session_id  text    not null references sessions (id) on delete cascade,
    chart       text    not null,   -- which chart draws it, such as gyro_norm
    series      text    not null,   -- which line of the chart, such as left
    cell_ns     integer not null,   -- length of a cell, ns
    first_cell  integer not null,   -- number of the first cell: that cell begins at first_cell × cell_ns
    cells       integer not null,   -- how many
    body        blob    not null,   -- one zstd frame: the smallest value of every cell, then the largest of
                                    -- every cell, f32 little-endian; NaN where a cell has none
    primary key (session_id, chart, series)
) strict, without rowid;
