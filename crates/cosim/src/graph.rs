//! Directed graphs: what must come before what, and what goes round in circles.

/// Strongly connected components (Tarjan), each before those that its edges lead to; nodes of one in increasing order.
/// `edges[a]` are the nodes that `a` leads to.
pub(crate) fn components(edges: &[Vec<usize>]) -> Vec<Vec<usize>> {
    const NONE: usize = usize::MAX;
    let n = edges.len();
    let (mut index, mut low, mut on_stack) = (vec![NONE; n], vec![0; n], vec![false; n]);
    let (mut stack, mut path, mut found, mut next) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for root in 0..n {
        if index[root] != NONE {
            continue;
        }
        path.push((root, 0));
        while let Some((v, edge)) = path.last_mut() {
            let v = *v;
            if *edge == 0 {
                (index[v], low[v], on_stack[v]) = (next, next, true);
                next += 1;
                stack.push(v);
            }
            if let Some(&w) = edges[v].get(*edge) {
                *edge += 1;
                if index[w] == NONE {
                    path.push((w, 0));
                } else if on_stack[w] {
                    low[v] = low[v].min(index[w]);
                }
                continue;
            }
            path.pop();
            if let Some((parent, _)) = path.last() {
                low[*parent] = low[*parent].min(low[v]);
            }
            if low[v] == index[v] {
                let mut component = Vec::new();
                while let Some(w) = stack.pop() {
                    on_stack[w] = false;
                    component.push(w);
                    if w == v {
                        break;
                    }
                }
                component.sort_unstable();
                found.push(component);
            }
        }
    }
    found.reverse();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circles_are_found_and_ordered() {
        // 0 -> 1 -> 2 -> 1, 2 -> 3, 4 -> 4 (by itself), 5 alone before 0
        let edges = [vec![1], vec![2], vec![1, 3], vec![], vec![4], vec![0]];
        let found = components(&edges);
        let at = |v: usize| found.iter().position(|c| c.contains(&v)).unwrap();
        assert!(found.contains(&vec![1, 2]));
        assert_eq!(found.len(), 5);
        assert!(at(5) < at(0) && at(0) < at(1) && at(1) < at(3));
        // A chain of a million does not overflow the stack.
        let long: Vec<Vec<usize>> =
            (1..=1_000_000).map(|i| if i < 1_000_000 { vec![i] } else { vec![] }).collect();
        assert_eq!(components(&long).len(), 1_000_000);
    }
}
