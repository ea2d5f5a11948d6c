//! Attributes of the types that are exchanged as JSON, and of the calls of the job table.

use proc_macro::TokenStream;
use proc_macro2::TokenStream as Tokens;
use quote::{ToTokens, format_ident, quote};
use syn::punctuated::Punctuated;
use syn::{
    Attribute, Expr, ExprRange, Field, Fields, GenericArgument, Ident, ImplItem, Item, ItemEnum,
    ItemImpl, LitStr, Path, PathArguments, Token, Type, Variant, parse_macro_input, parse_quote,
};

/// Omits the `Option` members of a struct, or of the variants of an enum, from the JSON while they are `None`, and declares them in the
/// contract as never `null`.
///
/// It adds `#[serde(skip_serializing_if = "Option::is_none")]` and `#[schema(nullable = false)]` to each of them, so it stands above the
/// derives. With the argument `nullable` the contract lets them be `null`. A member with a `#[schema(nullable …)]` of its own keeps that; a
/// member with `#[or_null]` is `null` while it is `None`. A member with `#[member(positive(…))]` is more than 0 in the contract too, and one
/// with a default may be left out.
#[proc_macro_attribute]
pub fn none_is_absent(argument: TokenStream, item: TokenStream) -> TokenStream {
    let mut item = parse_macro_input!(item as Item);
    let nullable = !argument.is_empty();
    let declare = |field: &mut Field| declare(field, nullable);
    match &mut item {
        Item::Struct(item) => item.fields.iter_mut().for_each(declare),
        Item::Enum(item) => {
            let fields = item.variants.iter_mut().flat_map(|it| &mut it.fields);
            fields.for_each(declare);
        }
        _ => {}
    }
    item.into_token_stream().into()
}

fn declare(field: &mut Field, null_too: bool) {
    for item in items(&field.attrs, "member") {
        let name = match &item {
            Expr::Call(call) => name_of(&call.func),
            Expr::Assign(given) => name_of(&given.left),
            item => name_of(item),
        };
        let declared = match name.as_str() {
            "positive" => parse_quote!(#[schema(exclusive_minimum = 0.0)]),
            "default" | "empty" => parse_quote!(#[schema(required = false)]),
            _ => continue,
        };
        field.attrs.push(declared);
    }
    if argument(&field.ty, "Option").is_none() {
        return;
    }
    let or_null = |it: &Attribute| it.path().is_ident("or_null");
    if field.attrs.iter().any(or_null) {
        return field.attrs.retain(|it| !or_null(it));
    }
    let omitted = parse_quote!(#[serde(skip_serializing_if = "Option::is_none")]);
    field.attrs.push(omitted);
    let declared = |it: &Attribute| {
        it.path().is_ident("schema") && it.to_token_stream().to_string().contains("nullable")
    };
    if !null_too && !field.attrs.iter().any(declared) {
        field.attrs.push(parse_quote!(#[schema(nullable = false)]));
    }
}

/// Runs the body of each async method of an `impl` by `engine::again`, which repeats it if its transaction gave way to another one.
///
/// It stands above `#[async_trait]`. A method with `#[once]` stays as it is.
#[proc_macro_attribute]
pub fn repeat_conflicts(_: TokenStream, item: TokenStream) -> TokenStream {
    let mut item = parse_macro_input!(item as ItemImpl);
    repeat(&mut item);
    item.into_token_stream().into()
}

fn repeat(item: &mut ItemImpl) {
    for member in &mut item.items {
        let ImplItem::Fn(method) = member else {
            continue;
        };
        let once = |it: &Attribute| it.path().is_ident("once");
        if method.attrs.iter().any(once) {
            method.attrs.retain(|it| !once(it));
        } else if method.sig.asyncness.is_some() {
            let body = &method.block;
            method.block = parse_quote!({ engine::again(|| async move #body).await });
        }
    }
}

/// Declares the trait that this `impl` for a store implements, with the documentation and the calls of the `impl`, and
/// repeats its calls as [`repeat_conflicts`] does. Both are passed to `async_trait`.
///
/// The shared statements are compiled once for each database, but a trait can be declared only once. The declaration is
/// therefore passed to the macro `declare!` of the database: one database declares it, the others import it.
#[proc_macro_attribute]
pub fn store_trait(_: TokenStream, item: TokenStream) -> TokenStream {
    let mut item = parse_macro_input!(item as ItemImpl);
    let name = item.trait_.as_ref().map(|(path, _)| path);
    let about = docs(&item.attrs);
    let calls = item.items.iter().filter_map(|member| match member {
        ImplItem::Fn(method) => Some((docs(&method.attrs), &method.sig)),
        _ => None,
    });
    let calls = calls.map(|(docs, signature)| quote!(#(#docs)* #signature;));
    let declaration = quote! {
        declare! {
            #name
            #(#about)*
            #[async_trait::async_trait]
            pub trait #name: Send + Sync {
                #(#calls)*
            }
        }
    };
    repeat(&mut item);
    quote!(#declaration #[async_trait::async_trait] #item).into()
}

fn docs(attributes: &[Attribute]) -> Vec<&Attribute> {
    let docs = attributes.iter().filter(|it| it.path().is_ident("doc"));
    docs.collect()
}

/// Declares an enum of unit variants whose values are words in snake case in JSON and in the contract. The arguments are further derives.
#[proc_macro_attribute]
pub fn keyword(derives: TokenStream, item: TokenStream) -> TokenStream {
    let (derives, item) = (Tokens::from(derives), Tokens::from(item));
    quote! {
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, utoipa::ToSchema, #derives)]
        #[serde(rename_all = "snake_case")]
        #item
    }
    .into()
}

/// Gives an enum of unit variants `WORDS`: the words of a request and what they mean, in the order of the variants. A word is the name of its
/// variant in snake case, as by `#[serde(rename_all = "snake_case")]`, or that of `#[serde(rename = …)]`.
#[proc_macro_derive(Words)]
pub fn words(item: TokenStream) -> TokenStream {
    let item = parse_macro_input!(item as ItemEnum);
    let (name, variants) = (&item.ident, item.variants.iter().map(|it| &it.ident));
    let words = item.variants.iter().map(word);
    quote! {
        impl #name {
            /// The words of a request and what they mean.
            pub(crate) const WORDS: &'static [(&'static str, #name)] = &[#((#words, #name::#variants)),*];
        }

        impl crate::case::words::object::Member for #name {
            fn read(
                block: &mut crate::case::words::object::Object,
                name: &str,
            ) -> Option<#name> {
                block.word(name, #name::WORDS)
            }
        }
    }
    .into()
}

/// Gives an enum of unit variants the function `name`: the word of a variant, as by [`Words`](macro@Words).
#[proc_macro_derive(Named, attributes(serde))]
pub fn named(item: TokenStream) -> TokenStream {
    let item = parse_macro_input!(item as ItemEnum);
    let (name, variants) = (&item.ident, item.variants.iter().map(|it| &it.ident));
    let words = item.variants.iter().map(word);
    quote! {
        impl #name {
            /// The word that stands for the value in requests, answers and messages.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self {
                    #(#name::#variants => #words,)*
                }
            }
        }
    }
    .into()
}

/// Derives `ALL`, `name` and `from_name` for an enum of unit variants: its values and their words, as in [`Words`](macro@Words).
#[proc_macro_derive(Names, attributes(serde))]
pub fn names(item: TokenStream) -> TokenStream {
    let named = Tokens::from(named(item.clone()));
    let item = parse_macro_input!(item as ItemEnum);
    let (vis, name, count) = (&item.vis, &item.ident, item.variants.len());
    let variants = item.variants.iter().map(|it| &it.ident);
    quote! {
        #named

        impl #name {
            /// Every value, in the order of their declaration.
            #vis const ALL: [#name; #count] = [#(#name::#variants),*];

            /// The value of this name.
            #[must_use]
            #vis fn from_name(name: &str) -> Option<#name> {
                #name::ALL.into_iter().find(|value| value.name() == name)
            }
        }
    }
    .into()
}

/// Derives the function `code` for an enum: the name of the variant in kebab case. Clients rely on it, so that it never changes.
#[proc_macro_derive(Code)]
pub fn code(item: TokenStream) -> TokenStream {
    let item = parse_macro_input!(item as ItemEnum);
    let (name, variants) = (&item.ident, item.variants.iter().map(|it| &it.ident));
    let codes = item.variants.iter().map(|it| word(it).replace('_', "-"));
    quote! {
        impl #name {
            /// The code that stands for the kind of the value.
            pub fn code(&self) -> &'static str {
                match self {
                    #(#name::#variants { .. } => #codes,)*
                }
            }
        }
    }
    .into()
}

/// Implements `Finite` for a struct, member by member, or for an enum without numbers.
#[proc_macro_derive(Finite)]
pub fn finite(item: TokenStream) -> TokenStream {
    let (name, fields) = match parse_macro_input!(item as Item) {
        Item::Struct(item) => (item.ident, item.fields),
        Item::Enum(item) => (item.ident, Fields::Unit),
        _ => return quote!(compile_error! { "a struct or an enum is needed" }).into(),
    };
    let members = fields.iter().filter_map(|it| it.ident.as_ref());
    let finite = quote!(crate::finite::Finite);
    quote! {
        impl #finite for #name {
            fn not_finite(&self) -> Option<String> {
                #(if let Some(path) = #finite::not_finite(&self.#members) {
                    return Some(format!(".{}{path}", stringify!(#members)));
                })*
                None
            }
        }
    }
    .into()
}

/// Gives a struct, or an enum of struct variants with `type` as its tag, the function `members`, which reads it from the members of a JSON
/// object with all of their faults. A member is needed unless its type is an `Option` or it has a default.
///
/// `#[member(…)]` of a field takes: the range of a number, as `positive(most, "unit")` or `closed(least, most, "unit")`; that of a count, as
/// `1..=10`; `default` or `default = value`; `empty`, if an absent member is read as an empty object; `what = "a sentence"` for the fault of a
/// missing member; `with = function`, which reads the value and is given the range too if there is one, or `whole = function`, which reads the
/// member whether it is there or not; `skip` for a field that is no member. `#[members(rule)]` of a struct or variant names a function that is called with the object and
/// what was read of it, and refuses members that do not go together.
#[proc_macro_derive(Members, attributes(member, members))]
pub fn members(item: TokenStream) -> TokenStream {
    let object = quote!(crate::case::words::object);
    match parse_macro_input!(item as Item) {
        Item::Struct(item) => {
            let name = &item.ident;
            let made = reader(&parse_quote!(#name), &item.fields, &item.attrs, &[]);
            quote! {
                impl #name {
                    #[doc = "Reads the members of an object."]
                    pub(crate) fn members(block: &mut #object::Object) -> Option<#name> {
                        #made
                    }
                }

                impl #object::Member for #name {
                    fn read(block: &mut #object::Object, name: &str) -> Option<#name> {
                        #name::members(&mut block.child(name)?)
                    }
                }
            }
        }
        Item::Enum(item) => {
            let name = &item.ident;
            let words: Vec<String> = item.variants.iter().map(word).collect();
            let variants: Vec<&Ident> = item.variants.iter().map(|it| &it.ident).collect();
            let readers: Vec<Ident> = words
                .iter()
                .map(|word| format_ident!("read_{word}"))
                .collect();
            let made = item.variants.iter().map(|it| {
                let variant = &it.ident;
                reader(
                    &parse_quote!(#name::#variant),
                    &it.fields,
                    &it.attrs,
                    &["type"],
                )
            });
            quote! {
                impl #name {
                    /// The word for its `type`.
                    #[must_use]
                    pub fn name(&self) -> &'static str {
                        match self {
                            #(#name::#variants { .. } => #words,)*
                        }
                    }

                    #[doc = "Reads the members of an object."]
                    pub(crate) fn members(block: &mut #object::Object) -> Option<#name> {
                        type Reader = fn(&mut #object::Object) -> Option<#name>;
                        let kinds: &[(&str, Reader)] = &[#((#words, #name::#readers)),*];
                        block.required("type", &format!("one of {}", #object::names(kinds)))?;
                        block.word("type", kinds)?(block)
                    }

                    #(fn #readers(block: &mut #object::Object) -> Option<#name> { #made })*
                }
            }
        }
        _ => quote!(compile_error! { "a struct or an enum is needed" }),
    }
    .into()
}

/// Reads the fields of a struct or variant from the object `block`.
fn reader(path: &Path, fields: &Fields, attributes: &[Attribute], before: &[&str]) -> Tokens {
    let named: Vec<&Ident> = fields.iter().filter_map(|it| it.ident.as_ref()).collect();
    let read = fields.iter().map(read_field);
    let skips = |it: &&Field| {
        let items = items(&it.attrs, "member");
        items.iter().any(|item| name_of(item) == "skip")
    };
    let words = fields.iter().filter(|it| !skips(it));
    let words = words.filter_map(|it| Some(it.ident.as_ref()?.to_string()));
    let words = before.iter().map(ToString::to_string).chain(words);
    let rules = items(attributes, "members");
    quote! {
        block.only(&[#(#words),*]);
        #(let #named = #read;)*
        let all = move || Some(#path { #(#named: #named?),* });
        let all = all();
        #(#rules(block, all.as_ref())?;)*
        all
    }
}

fn read_field(field: &Field) -> Tokens {
    let object = quote!(crate::case::words::object);
    let items = items(&field.attrs, "member");
    let value = |wanted: &str| {
        items.iter().find_map(|item| match item {
            Expr::Assign(given) if name_of(&given.left) == wanted => {
                Some(given.right.to_token_stream())
            }
            item if name_of(item) == wanted => Some(quote!(Default::default())),
            _ => None,
        })
    };
    let range = items.iter().find_map(|item| match item {
        Expr::Call(call) => Some(quote!(#object::AllowedRange::#call)),
        Expr::Range(ExprRange { start, end, .. }) => Some(quote!(#start, #end)),
        _ => None,
    });
    let member = field.ident.as_ref().map(ToString::to_string);
    let member = member.unwrap_or_default();
    let optional = argument(&field.ty, "Option");
    let own = optional.unwrap_or(&field.ty);
    let kind = own.to_token_stream().to_string();
    let read = match (kind.as_str(), value("with")) {
        (_, Some(with)) if range.is_some() => quote!(|block, name| #with(block, name, #range)),
        (_, Some(with)) => quote!(#with),
        ("f64", _) => quote!(|block, name| block.number(name, #range)),
        ("u32", _) => quote!(|block, name| block.required_count(name, #range)),
        ("bool", _) => quote!(#object::Object::flag),
        _ => quote!(<#own as #object::Member>::read),
    };
    let here = match (value("with"), &range) {
        (Some(with), Some(range)) => quote!(#with(block, #member, #range)),
        _ => quote!(#read(block, #member)),
    };
    if let Some(skipped) = value("skip") {
        quote!(Some(#skipped))
    } else if let Some(whole) = value("whole") {
        quote!(#whole(block, #member))
    } else if value("empty").is_some() {
        quote!(block.child_or_empty(#member).and_then(|mut block| <#own>::members(&mut block)))
    } else if optional.is_some() {
        quote!(block.optional(#member, #read))
    } else if let Some(default) = value("default") {
        quote!(block.optional(#member, #read).map(|read| read.unwrap_or(#default)))
    } else if let Some(what) = value("what") {
        quote!(block.required(#member, #what).and_then(|_| #here))
    } else {
        match kind.as_str() {
            "f64" => quote!(block.required_number(#member, #range)),
            "u32" => quote!(block.required_count(#member, #range)),
            _ => here,
        }
    }
}

/// Returns the arguments of all attributes with this name.
fn items(attributes: &[Attribute], name: &str) -> Vec<Expr> {
    let own = attributes.iter().filter(|it| it.path().is_ident(name));
    own.filter_map(|it| {
        it.parse_args_with(Punctuated::<Expr, Token![,]>::parse_terminated)
            .ok()
    })
    .flatten()
    .collect()
}

/// A single name, or nothing.
fn name_of(item: &Expr) -> String {
    match item {
        Expr::Path(path) => path
            .path
            .get_ident()
            .map(ToString::to_string)
            .unwrap_or_default(),
        _ => String::new(),
    }
}

/// The argument of a type with one, such as `Option<T>`.
fn argument<'a>(of: &'a Type, name: &str) -> Option<&'a Type> {
    let Type::Path(path) = of else { return None };
    let last = path.path.segments.last().filter(|it| it.ident == name)?;
    let PathArguments::AngleBracketed(arguments) = &last.arguments else {
        return None;
    };
    arguments.args.iter().find_map(|it| match it {
        GenericArgument::Type(own) => Some(own),
        _ => None,
    })
}

fn word(variant: &Variant) -> String {
    let mut word = String::new();
    for letter in variant.ident.to_string().chars() {
        if letter.is_uppercase() && !word.is_empty() {
            word.push('_');
        }
        word.extend(letter.to_lowercase());
    }
    for attribute in variant
        .attrs
        .iter()
        .filter(|it| it.path().is_ident("serde"))
    {
        // Serde reports errors of its other arguments.
        let _ = attribute.parse_nested_meta(|meta| {
            if meta.path.is_ident("rename") {
                word = meta.value()?.parse::<LitStr>()?.value();
            }
            Ok(())
        });
    }
    word
}
