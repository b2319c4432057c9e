//! Tables of what readers refuse or take for the same, in `refused/*.txt`: a case a line, its cells separated by ` => `.

/// The cases of a table. `\n` in a cell stands for a line break; `\r` and `\t` likewise.
pub(crate) fn cases<const N: usize>(table: &str) -> impl Iterator<Item = [String; N]> {
    let rows = table.lines().filter(|line| !line.starts_with('#'));
    rows.map(|row| {
        let cell = |cell: &str| cell.replace("\\n", "\n").replace("\\r", "\r");
        let cells = row
            .splitn(N, " => ")
            .map(|text| cell(text).replace("\\t", "\t"));
        let cells: Vec<String> = cells.collect();
        cells.try_into().unwrap_or_else(|_| panic!("{row}"))
    })
}
