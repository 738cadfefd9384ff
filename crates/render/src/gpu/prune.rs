//! Dead code elimination, based on a kernel's constants. Drivers do this only after inlining, at far greater cost.

use naga::compact::{KeepUnused, compact};
use naga::{Arena, Block, Expression, Literal, Module, Statement};

/// Replaces each branch on a constant by the block that is executed, then removes unused items.
pub fn prune(module: &mut Module) {
    let functions = module.functions.iter_mut().map(|(_, function)| function);
    let entry_points = module
        .entry_points
        .iter_mut()
        .map(|entry_point| &mut entry_point.function);
    for function in functions.chain(entry_points) {
        let body = std::mem::take(&mut function.body);
        function.named_expressions.clear(); // named expressions count as used, even in removed blocks
        function.body = without_dead_branches(body, &function.expressions).0;
    }
    compact(module, KeepUnused::No);
}

/// Returns a block without dead branches, and true if the block ends with a jump.
fn without_dead_branches(block: Block, expressions: &Arena<Expression>) -> (Block, bool) {
    let mut out = Block::new();
    for (statement, span) in block.span_into_iter() {
        match statement {
            Statement::If {
                condition,
                accept,
                reject,
            } => match expressions[condition] {
                Expression::Literal(Literal::Bool(value)) => {
                    let (inner, jumps) = without_dead_branches(if value { accept } else { reject }, expressions);
                    inner
                        .span_into_iter()
                        .for_each(|(statement, span)| out.push(statement, span));
                    if jumps {
                        return (out, true);
                    }
                }
                _ => {
                    let (accept, reject) = (
                        without_dead_branches(accept, expressions).0,
                        without_dead_branches(reject, expressions).0,
                    );
                    out.push(
                        Statement::If {
                            condition,
                            accept,
                            reject,
                        },
                        span,
                    );
                }
            },
            Statement::Block(inner) => {
                let (inner, jumps) = without_dead_branches(inner, expressions);
                out.push(Statement::Block(inner), span);
                if jumps {
                    return (out, true);
                }
            }
            Statement::Loop {
                body,
                continuing,
                break_if,
            } => {
                let (body, continuing) = (
                    without_dead_branches(body, expressions).0,
                    without_dead_branches(continuing, expressions).0,
                );
                out.push(
                    Statement::Loop {
                        body,
                        continuing,
                        break_if,
                    },
                    span,
                );
            }
            Statement::Return { .. } | Statement::Break | Statement::Continue | Statement::Kill => {
                out.push(statement, span);
                return (out, true);
            }
            other => out.push(other, span),
        }
    }
    (out, false)
}
