//! Correctly rounded quotients and square roots for devices that round them differently: function calls replace the
//! operations in naga modules.

use std::collections::HashMap;

use naga::valid::{FunctionInfo, ModuleInfo};
use naga::{
    Arena, BinaryOperator, Block, Expression, Function, Handle, MathFunction, Module, Range, ScalarKind, Statement,
    TypeInner,
};

/// Implementation of quotients and square roots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rounding {
    /// The device's operations: correctly rounded on lavapipe, within 2.5 ULP on GPUs (WGSL, section 15.7.4).
    Device,
    /// Functions of `shaders/rounding.wgsl`: correctly rounded, but slower.
    Software,
}

/// For each expression to replace, the function that is called and its arguments.
type Calls = HashMap<Handle<Expression>, (Handle<Function>, Vec<Handle<Expression>>)>;

const QUOTIENTS: [&str; 4] = ["quotient", "quotient2", "quotient3", "quotient4"];
const SQUARE_ROOTS: [&str; 4] = ["square_root", "square_root2", "square_root3", "square_root4"];

/// A function that `shaders/rounding.wgsl` lacks.
#[derive(Debug, thiserror::Error)]
#[error("the function '{0}' is missing")]
pub struct MissingFunction(&'static str);

/// Replaces all float quotients and square roots by calls of `shaders/rounding.wgsl`.
pub fn round_in_software(module: &mut Module, info: &ModuleInfo) -> Result<(), MissingFunction> {
    // These two functions use the device's operations.
    let excluded = [
        function_named(module, QUOTIENTS[0])?,
        function_named(module, SQUARE_ROOTS[0])?,
    ];
    let mut in_functions = Vec::new();
    for (handle, function) in module.functions.iter() {
        if !excluded.contains(&handle) {
            in_functions.push((handle, calls_of(module, function, &info[handle])?));
        }
    }
    let mut in_entry_points = Vec::new();
    for (i, entry_point) in module.entry_points.iter().enumerate() {
        in_entry_points.push(calls_of(module, &entry_point.function, info.get_entry_point(i))?);
    }
    for (handle, calls) in in_functions {
        let function = &mut module.functions[handle];
        insert_calls(&mut function.body, &mut function.expressions, &calls);
    }
    for (entry_point, calls) in module.entry_points.iter_mut().zip(in_entry_points) {
        let function = &mut entry_point.function;
        insert_calls(&mut function.body, &mut function.expressions, &calls);
    }
    Ok(())
}

fn function_named(module: &Module, name: &'static str) -> Result<Handle<Function>, MissingFunction> {
    let found = module.functions.iter().find(|(_, f)| f.name.as_deref() == Some(name));
    found.map(|(handle, _)| handle).ok_or(MissingFunction(name))
}

fn calls_of(module: &Module, function: &Function, info: &FunctionInfo) -> Result<Calls, MissingFunction> {
    let mut calls = Calls::new();
    for (handle, expression) in function.expressions.iter() {
        let (names, arguments) = match *expression {
            Expression::Binary {
                op: BinaryOperator::Divide,
                left,
                right,
            } => (QUOTIENTS, vec![left, right]),
            Expression::Math {
                fun: MathFunction::Sqrt,
                arg,
                ..
            } => (SQUARE_ROOTS, vec![arg]),
            _ => continue,
        };
        let components = match info[handle].ty.inner_with(&module.types) {
            TypeInner::Scalar(s) if s.kind == ScalarKind::Float => 1,
            TypeInner::Vector { size, scalar } if scalar.kind == ScalarKind::Float => *size as usize,
            _ => continue, // integers
        };
        calls.insert(handle, (function_named(module, names[components - 1])?, arguments));
    }
    Ok(calls)
}

/// Splits the evaluation range at each replaced expression, and inserts the call that replaces the expression.
fn insert_calls(block: &mut Block, expressions: &mut Arena<Expression>, calls: &Calls) {
    for (statement, span) in std::mem::take(block).span_into_iter() {
        let Statement::Emit(range) = statement else {
            block.push(with_calls(statement, expressions, calls), span);
            continue;
        };
        let mut emitted: Option<(Handle<Expression>, Handle<Expression>)> = None;
        let emit = |block: &mut Block, emitted: &mut Option<_>| {
            if let Some((first, last)) = emitted.take() {
                block.push(Statement::Emit(Range::new_from_bounds(first, last)), span);
            }
        };
        for handle in range {
            if let Some((function, arguments)) = calls.get(&handle) {
                emit(block, &mut emitted);
                expressions[handle] = Expression::CallResult(*function);
                let (function, arguments, result) = (*function, arguments.clone(), Some(handle));
                block.push(
                    Statement::Call {
                        function,
                        arguments,
                        result,
                    },
                    span,
                );
            } else {
                emitted = Some((emitted.map_or(handle, |(first, _)| first), handle));
            }
        }
        emit(block, &mut emitted);
    }
}

fn with_calls(mut statement: Statement, expressions: &mut Arena<Expression>, calls: &Calls) -> Statement {
    match &mut statement {
        Statement::Block(block) => insert_calls(block, expressions, calls),
        Statement::If {
            accept: first,
            reject: second,
            ..
        }
        | Statement::Loop {
            body: first,
            continuing: second,
            ..
        } => {
            insert_calls(first, expressions, calls);
            insert_calls(second, expressions, calls);
        }
        Statement::Switch { cases, .. } => cases
            .iter_mut()
            .for_each(|case| insert_calls(&mut case.body, expressions, calls)),
        _ => {}
    }
    statement
}
