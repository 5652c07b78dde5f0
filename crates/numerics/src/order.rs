//! Lists in the order of a figure of their items. The sort itself is compiled once, not for every kind of item.

/// Largest figure first; items of the same figure keep their order. Each figure is computed once.
pub fn descending<T>(all: &mut Vec<T>, figure: impl Fn(&T) -> f64) {
    arrange(all, largest_first(all.iter().map(figure).collect()));
}

/// Smallest figure first; otherwise as [`descending`].
pub fn ascending<T>(all: &mut Vec<T>, figure: impl Fn(&T) -> f64) {
    arrange(all, largest_first(all.iter().map(|item| -figure(item)).collect()));
}

/// Places of these figures, that of the largest first.
#[inline(never)]
fn largest_first(figures: Vec<f64>) -> Vec<usize> {
    let mut order: Vec<usize> = (0..figures.len()).collect();
    order.sort_by(|a, b| figures[*b].total_cmp(&figures[*a]));
    order
}

/// Permutes items in place: item `k` becomes the one at place `k` of this list.
fn arrange<T>(all: &mut Vec<T>, order: Vec<usize>) {
    let mut taken: Vec<Option<T>> = all.drain(..).map(Some).collect();
    all.extend(order.into_iter().filter_map(|at| taken[at].take()));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_figures_stay_as_they_lie() {
        let list = || vec![(1.0, 'a'), (3.0, 'b'), (f64::NEG_INFINITY, 'c'), (1.0, 'd'), (3.0, 'e')];
        let told = |list: Vec<(f64, char)>| list.into_iter().map(|item| item.1).collect::<String>();
        let (mut down, mut up) = (list(), list());
        descending(&mut down, |item| item.0);
        ascending(&mut up, |item| item.0);
        assert_eq!((told(down), told(up)), ("beadc".to_owned(), "cadbe".to_owned()));
        let mut not_a_number = vec![f64::NAN, 2.0];
        descending(&mut not_a_number, |v| *v);
        assert!(not_a_number[0].is_nan() && not_a_number[1] == 2.0);
    }
}
